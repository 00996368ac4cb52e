"""Progress bars on a terminal, Snakemake's own lines everywhere else: what the default profile names as its `logger`.

The bars are those of snakemake-logger-plugin-rich, which draws them into logs as well, wrapped at 80 columns. A profile cannot tell
a terminal from a log, so this plugin does. Snakemake finds it by its module's name.
"""

import sys
from logging import LogRecord

from snakemake.settings.enums import Quietness
from snakemake_logger_plugin_rich import LogHandler as RichBars


class LogHandler(RichBars):
    """The bars, if there is a terminal to draw them on and nobody asked for less; otherwise nothing.

    A handler that does not write to the stream lets Snakemake add its own.
    """

    def __post_init__(self) -> None:
        """Decide once, before Snakemake asks whether this handler writes to the stream."""
        settings = self.common_settings
        stream = sys.stdout if settings.stdout else sys.stderr
        asked_for_less = {Quietness.ALL, Quietness.PROGRESS} & set(settings.quiet or ())
        self._draws = stream.isatty() and not settings.dryrun and not asked_for_less
        if self._draws:
            super().__post_init__()

    def emit(self, record: LogRecord) -> None:
        """Draw, or leave the record to Snakemake's own handler."""
        if self._draws:
            super().emit(record)

    def close(self) -> None:
        """Take the bars off the terminal."""
        if self._draws:
            super().close()

    @property
    def writes_to_stream(self) -> bool:
        """Whether Snakemake's own lines are to be left out."""
        return self._draws
