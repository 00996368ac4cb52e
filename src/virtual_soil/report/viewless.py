"""What a test declares that has no interactive views beside those of its grains before and after."""

import pandas as pd

from virtual_soil.report.study import Study


def views(_study: Study, _rows: pd.DataFrame) -> dict:
    """No view without grains."""
    return {}


def packed_views(_study: Study) -> dict:
    """No view of moving grains."""
    return {}
