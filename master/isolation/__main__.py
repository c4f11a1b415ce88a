"""The process of an isolated FMU."""

from master.isolation.child import main

main()
