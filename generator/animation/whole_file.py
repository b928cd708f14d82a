"""Moved to `generator.whole_file`."""

from generator.whole_file import reason_of, why_not_writable, write_whole

__all__ = ["reason_of", "why_not_writable", "write_whole"]
