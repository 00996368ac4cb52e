"""Three bulk benchmarks beside LIGGGHTS: impact of a ball on a bed, rotating drum, emptying of a silo.

Set-ups: Dosta et al. 2024, Computer Physics Communications, article 109066, as two of its participants' public case files have them
(MercuryDPM, YADE). Both codes start from the same packing, without contact history, and run on one thread. Stated deviations are
those of a module's `Setup`: softer grains, shorter times, a late start.
"""
