"""What each command answers: text, data and exit code, without printing any of it."""
