"""The same tests in another program: heap, direct shear and a single rolling contact in LIGGGHTS beside our engine.

    python -m virtual_soil.verification.peers

LIGGGHTS-PUBLIC is run as the distribution ships it, with `model hertz tangential history rolling_friction epsd2`. From its
source (https://github.com/CFDEMproject/LIGGGHTS-PUBLIC, `rolling_model_epsd2.h`, `normal_model_hertz.h`, version 3.8.0):

    k_r = S_t R*^2,  S_t = 8 G* sqrt(R* delta),  |M| <= mu_r |F_n| R*,  driven by the relative spin of the two grains,

with R* = r/2 between equal grains and R* = r at a wall. Our type C is the same law; it keeps the rolled angle and epsd2 the
torque, which differ only while the overlap of a contact changes. Our type A, EDEM's, gives each grain mu_r F_n r against its *own*
spin: the same number mu_r means twice the torque, and grains that roll together like gear wheels are braked too.
"""
