"""The engine once more, slow and obvious: plain Python, float64, every grain against every other and every wall at each step.

It shares no code with the kernels: vectors are NumPy arrays, histories a dictionary, the laws written as in their sources.
"""

import math

import numpy as np
from scipy.optimize import brentq


class Contact:
    """What a pair of grains, or a grain and a wall (R_j and the second mass infinite), need for their force law."""

    def __init__(self, material_i, material_j, interaction, r_i, r_j, m_i, m_j):
        G_i, nu_i = material_i.shear_modulus_pa, material_i.poisson_ratio
        G_j, nu_j = material_j.shear_modulus_pa, material_j.poisson_ratio
        E_i, E_j = 2 * G_i * (1 + nu_i), 2 * G_j * (1 + nu_j)
        self.E = 1 / ((1 - nu_i**2) / E_i + (1 - nu_j**2) / E_j)
        self.G = 1 / ((2 - nu_i) / G_i + (2 - nu_j) / G_j)
        self.R = 1 / (1 / r_i + 1 / r_j)
        self.m = 1 / (1 / m_i + 1 / m_j)
        self.interaction = interaction
        log_e = math.log(interaction.restitution)
        self.beta = -log_e / math.sqrt(log_e**2 + math.pi**2)


class SlowTwin:
    """Built from a fast simulation at rest in its lists: the same grains, materials, walls, and no contact history."""

    def __init__(
        self,
        simulation,
        material_names,
        interactions,
        rolling_model="type_a",
        gravity=(0, 0, -9.81),
        period=(0, 0, 0),
        adhesion=None,
        tangential_model="edem",
    ):
        self.adhesion, self.held, self.outlasted = adhesion, set(), 0
        grains = simulation.grains
        self.x, self.v, self.w, self.r = grains.positions_m, grains.velocities_m_s, grains.angular_velocities_rad_s, grains.radii_m
        self.names, self.materials, self.interactions = material_names, simulation.materials, interactions
        self.walls = [simulation.wall(name) for name in simulation.wall_names]
        self.wall_x = [np.zeros(3) for _ in self.walls]
        self.m = np.array(
            [self.materials[n].density_kg_m3 * 4 / 3 * math.pi * r**3 for n, r in zip(self.names, self.r, strict=True)]
        )
        self.dt, self.gravity, self.period = simulation.time_step_s, np.array(gravity), np.array(period)
        self.type_c, self.bounds_spring_alone = rolling_model == "type_c", tangential_model == "liggghts"
        self.springs, self.beyond_coulomb = {}, 0

    def touch(self, a, b):
        return self.interactions.get((a, b)) or self.interactions[b, a]

    def step(self):
        n = len(self.r)
        force, torque, resistance = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)
        self.wall_forces = [np.zeros(3) for _ in self.walls]
        touching = set()
        for i in range(n):
            for j in range(i + 1, n):
                apart = self.x[i] - self.x[j]
                for a in range(3):
                    if self.period[a]:
                        apart[a] -= self.period[a] * round(apart[a] / self.period[a])
                if self.acts((i, j), self.names[j], self.r[j], self.r[i] + self.r[j] - np.linalg.norm(apart)):
                    touching.add((i, j))
                    f, t_i, t_j, roll_i, roll_j = self.loads(i, j, apart)
                    force[i] += f
                    force[j] -= f
                    torque[i] += t_i
                    torque[j] += t_j
                    resistance[i] += roll_i
                    resistance[j] += roll_j
            for k, wall in enumerate(self.walls):
                apart = self.from_wall(i, wall, self.wall_x[k])
                if self.acts((i, wall.name), wall.material, math.inf, self.r[i] - np.linalg.norm(apart)):
                    touching.add((i, wall.name))
                    f, t_i, _, roll_i, _ = self.loads(i, wall, apart)
                    force[i] += f
                    torque[i] += t_i
                    resistance[i] += roll_i
                    self.wall_forces[k] -= f
        self.held = touching
        self.springs = {key: spring for key, spring in self.springs.items() if key in touching}
        for i in range(n):
            inertia = 0.4 * self.m[i] * self.r[i] ** 2
            self.v[i] += (force[i] / self.m[i] + self.gravity) * self.dt
            self.w[i] += torque[i] / inertia * self.dt
            spin = np.linalg.norm(self.w[i])
            if spin > 0:
                self.w[i] *= max(0.0, 1 - resistance[i] / inertia * self.dt / spin)
            self.x[i] += self.v[i] * self.dt
        for k, wall in enumerate(self.walls):
            self.wall_x[k] += np.array(wall.velocity_m_s) * self.dt

    def acts(self, key, name_j, r_j, overlap):
        """True if a contact acts: with an overlap, with JKR until it is torn off."""
        if overlap > 0 or self.adhesion != "jkr" or key not in self.held:
            return overlap > 0
        name_i, r_i = self.names[key[0]], self.r[key[0]]
        law = Contact(self.materials[name_i], self.materials[name_j], self.touch(name_i, name_j), r_i, r_j, 1.0, 1.0)
        torn_radius = (math.pi * law.interaction.work_of_adhesion_j_m2 * law.R**2 / (8 * law.E)) ** (1 / 3)
        holds = overlap > -3 * torn_radius**2 / law.R
        self.outlasted += holds
        return holds

    def deformation(self, law, overlap):
        """Overlap of the Hertz contact of the same radius, and the attraction."""
        w = law.interaction.work_of_adhesion_j_m2
        if self.adhesion != "jkr" or w == 0.0:
            return overlap, 2 * math.pi * w * law.R
        torn_radius = (math.pi * w * law.R**2 / (8 * law.E)) ** (1 / 3)
        a = brentq(
            lambda a: a**2 / law.R - math.sqrt(2 * math.pi * w * a / law.E) - overlap,
            torn_radius,
            10 * law.R,
            xtol=1e-20,
            rtol=1e-14,
        )
        return a**2 / law.R, math.sqrt(8 * math.pi * w * law.E * a**3)

    def from_wall(self, i, wall, moved):
        x = self.x[i] - moved
        if hasattr(wall, "low_m"):
            return x - np.minimum(np.maximum(x, wall.low_m), wall.high_m)
        across = x[:2] - wall.centre_m
        nearest = np.append(
            wall.centre_m + across / np.linalg.norm(across) * wall.radius_m, min(max(x[2], wall.bottom_m), wall.top_m)
        )
        return x - nearest

    def loads(self, i, j, apart):
        """Force and torque on i, torque on j, type A resisting torques of both; keeps the springs."""
        is_wall = not isinstance(j, int)
        name_j = j.material if is_wall else self.names[j]
        r_j, m_j = (math.inf, math.inf) if is_wall else (self.r[j], self.m[j])
        v_j, w_j = (np.array(j.velocity_m_s), np.zeros(3)) if is_wall else (self.v[j], self.w[j])
        touch = self.touch(self.names[i], name_j)
        law = Contact(self.materials[self.names[i]], self.materials[name_j], touch, self.r[i], r_j, self.m[i], m_j)
        d = np.linalg.norm(apart)
        n = apart / d
        overlap = self.r[i] + (0.0 if is_wall else r_j) - d
        overlap, attraction = self.deformation(law, overlap)
        share = 1.0 if is_wall else self.r[i] / (self.r[i] + r_j)  # the contact point divides the overlap
        arm_i, arm_j = -d * share * n, d * (1 - share) * n
        v = self.v[i] + np.cross(self.w[i], arm_i) - v_j - np.cross(w_j, arm_j)
        v_n = v @ n
        v_t = v - v_n * n
        S_n, S_t = 2 * law.E * math.sqrt(law.R * overlap), 8 * law.G * math.sqrt(law.R * overlap)
        damp = 2 * math.sqrt(5 / 6) * law.beta
        f_n = 4 / 3 * law.E * math.sqrt(law.R) * overlap**1.5 - damp * math.sqrt(S_n * law.m) * v_n
        push = max(f_n, 0.0)
        key = (i, j.name if is_wall else j)
        s, theta = self.springs.get(key, (np.zeros(3), np.zeros(3)))
        s = s - (s @ n) * n + v_t * self.dt
        limit = touch.static_friction * (abs(f_n) if self.bounds_spring_alone else push)
        slips = S_t * np.linalg.norm(s) > limit
        if slips:
            s = s * (limit / (S_t * np.linalg.norm(s)))
        f_t = S_t * s
        if not (slips and self.bounds_spring_alone):
            f_t = f_t + damp * math.sqrt(S_t * law.m) * v_t
        if np.linalg.norm(f_t) > limit and not self.bounds_spring_alone:
            f_t = f_t * (limit / np.linalg.norm(f_t))
        self.beyond_coulomb += np.linalg.norm(f_t) > 1.01 * touch.static_friction * push
        t_i, t_j = np.cross(arm_i, -f_t), np.cross(arm_j, f_t)
        roll = touch.rolling_friction * push
        if self.type_c:
            theta = theta + (self.w[i] - w_j) * self.dt
            theta = theta - (theta @ n) * n
            k_r = S_t * law.R**2
            moment = k_r * np.linalg.norm(theta)
            if moment > roll * law.R:
                theta = theta * (roll * law.R / moment)
            t_i, t_j = t_i - k_r * theta, t_j + k_r * theta
        self.springs[key] = (s, theta)
        resist = (0.0, 0.0) if self.type_c else (roll * self.r[i], 0.0 if is_wall else roll * r_j)
        return (f_n - attraction) * n - f_t, t_i, t_j, *resist
