"""What each command takes: its arguments, options and help, nothing slow.

A function of the command line returns an `Answer`; what makes it is imported when it is called.
"""
