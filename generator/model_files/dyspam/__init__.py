"""The input files of the thesis's simulator, DYSPAM."""
