"""Comparison with other programs: heap, direct shear and a single rolling contact in LIGGGHTS and in our engine, and adhesion.

Adhesion (`peers.adhesion`) is compared with LAMMPS, too, where it is installed.

    python -m virtual_soil.verification.peers

LIGGGHTS-PUBLIC is run as packaged by the distribution, with `model hertz tangential history rolling_friction epsd2`. From its
source (https://github.com/CFDEMproject/LIGGGHTS-PUBLIC, `rolling_model_epsd2.h`, `normal_model_hertz.h`, version 3.8.0):

    k_r = S_t R*^2,  S_t = 8 G* sqrt(R* delta),  |M| <= mu_r |F_n| R*,  driven by the relative spin of the two grains,

with R* = r/2 between equal grains and R* = r at a wall. Our type C is the same law. It stores the rolling angle, epsd2 the
torque; they differ only while the overlap of a contact changes. Our type A (EDEM) applies mu_r F_n r against each grain's *own*
spin. With the same mu_r its torque is twice as large, and it also acts between grains of equal spins, where epsd2 has no torque.
"""
