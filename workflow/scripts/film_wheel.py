"""Adapt rule `film_wheel` to `virtual_soil.wheel.film` and `virtual_soil.report.wheel_film`."""

from _log import log_to
from virtual_soil.report.wheel_film import write_film
from virtual_soil.wheel.film import film_wheel

if __name__ == "__main__":
    log_to(snakemake.log[0])
    wildcards, output = dict(snakemake.wildcards.items()), snakemake.output
    frames = film_wheel(dict(snakemake.params.items()), wildcards["slip"], snakemake.input.bed, snakemake.input.lowered)
    title = f"{wildcards['case']}, slip {wildcards['slip']}"
    write_film(frames, title, output.film, output.series, output.moments, output.surfaces)
