"""The sections of the report: a module and a template per section, and the only list of them.

Every module declares

- NAME, the anchor and the name of the template <NAME>.html.j2; TITLE in Snakemake's report; HEADING on the page; LINKS, anchor ->
  text in the page's contents;
- FIGURES, name -> `Entry`, and figures(study), name -> `Item`;
- TABLES, name -> title, and tables(study), name -> table as it is shown;
- words(study), what else the template shows, such as remarks.
"""

from types import ModuleType

from virtual_soil.report.sections import (
    answer,
    checks,
    optimisation,
    screening,
    soils,
    surrogates,
    uncertainty,
    verification,
)

SECTIONS: tuple[ModuleType, ...] = (
    answer,
    soils,
    screening,
    surrogates,
    optimisation,
    uncertainty,
    verification,
    checks,
)
