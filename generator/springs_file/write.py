"""Writer of springs files, the inverse of the reader."""

from generator.springs_file.coupled import COUPLED_ROWS
from generator.springs_file.parse import (
    COUPLED_TABLE,
    FILE_ROWS,
    REACH_TABLE,
    SPRING_TABLE,
    SpringsFile,
    entry_lines,
)
from generator.springs_file.reach import REACH_ROWS
from generator.toml_file.writer import document_to_toml


def write_springs(content: SpringsFile, comment: str = "") -> str:
    """Return the text of a springs file; reading it returns equal springs, bit for bit.

    Args:
        content: Springs to write.
        comment: One or more lines above them.

    Raises:
        ValueError: for a number that is not finite, a line that is too long, or a law that no key
            holds.
    """
    tables = [(SPRING_TABLE, entry_lines(entry)) for entry in content.entries]
    tables += [(REACH_TABLE, REACH_ROWS.lines(entry)) for entry in content.reaches]
    tables += [(COUPLED_TABLE, COUPLED_ROWS.lines(entry)) for entry in content.coupled]
    return document_to_toml(FILE_ROWS.noun, FILE_ROWS.lines(content), tables, comment)
