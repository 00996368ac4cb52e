"""Contacts of a wall, read between two steps."""

import numpy as np
import pytest
from test_bodies import bed, body, numbers, scene

import dem
from dem import solids

#: Grains in front of the wheel, which takes them down into the bed.
GLUED = [(k * 28 + 14) * 6 + layer for k in range(23, 29) for layer in (4, 5)]


@pytest.fixture(scope="module")
def running():
    """A turning wheel with glued grains in a bed of two slabs: a mesh, a box and grains carry loads."""
    simulation = bed()
    simulation.glue(GLUED, "wheel")
    simulation.drive_wall("wheel")
    simulation.move_wall("wheel", (0.0, 0.0, -0.2))
    simulation.advance(1000)
    return simulation


def summed(found):
    return np.concatenate([found.forces_n.sum(axis=0), found.torques_n_m.sum(axis=0)])


def test_forces_and_torques_add_up_to_those_of_the_step_to_come(running):
    simulation = dem.unpacked(dem.packed(running))
    found = {name: simulation.wall_contacts(name) for name in ("wheel", "floor", "far")}
    simulation.advance(1)
    for name, contacts in found.items():
        loads = np.concatenate([simulation.mean_wall_forces_n[name], simulation.mean_wall_torques_n_m[name]])
        scale = np.abs(contacts.forces_n).sum()
        assert summed(contacts)[:3] == pytest.approx(loads[:3], abs=1e-6 * scale)
        assert summed(contacts)[3:] == pytest.approx(loads[3:], abs=1e-6 * scale * 0.05)
    assert (~np.isin(found["wheel"].grains, GLUED)).sum() > 5
    assert len(found["floor"]) > 500
    assert len(found["far"]) == 0


def test_a_grain_glued_to_the_wall_has_its_own_load(running):
    found = running.wall_contacts("wheel")
    theirs = np.isin(found.grains, GLUED)
    assert theirs.sum() >= 2
    assert found.points_m[theirs] == pytest.approx(running.grains.positions_m[found.grains[theirs]])


def test_reading_changes_nothing(running):
    read, plain = (dem.unpacked(dem.packed(running)) for _ in range(2))
    for _ in range(3):
        for name in ("wheel", "floor"):
            read.wall_contacts(name)
        assert not any(part.contacts.count.any() for part in read._state.lists[:2])  # nothing is left for the next step to store
        for simulation in (read, plain):
            simulation.advance(20)
    assert (numbers(read) == numbers(plain)).all()


def test_points_are_where_grains_touch():
    slab = body(solids.box((0.03, 0.03, 0.01), position_m=(0.0, 0.02, -0.005)))
    floor = dem.Box(name="floor", material="soil", low_m=(0.1, -np.inf, -1.0), high_m=(1.0, np.inf, 0.0))
    simulation = scene([slab, floor])
    places = [(0.01, 0.025, 0.999e-3), (0.01, 0.022, 0.5), (0.2, 0.01, 0.999e-3)]
    simulation.add_grains(places, 1e-3, "soil")
    simulation.advance(1)
    for name, number in (("body", 0), ("floor", 2)):
        found = simulation.wall_contacts(name)
        assert found.grains.tolist() == [number]
        assert found.points_m[0] == pytest.approx(np.array(places[number]) * (1.0, 1.0, 0.0), abs=1e-8)
        assert found.forces_n[0, 2] < 0.0
    pressed = simulation.wall_contacts("body")
    x, y = 0.01, 0.005  # from the body's origin
    force = pressed.forces_n[0, 2]
    assert pressed.torques_n_m[0] == pytest.approx((y * force, -x * force, 0.0), rel=1e-4, abs=1e-9)


def test_contacts_are_not_known_before_the_first_step():
    simulation = scene([body(solids.box((0.03, 0.03, 0.01)))])
    with pytest.raises(ValueError, match="contacts of a wall is not known; allowed: a simulation that has made a step"):
        simulation.wall_contacts("body")
