"""`python -m benchmarks`: how fast the prototype falls, and what the time goes into."""

from benchmarks.prototype import main

main()
