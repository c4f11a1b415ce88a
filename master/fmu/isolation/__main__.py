"""The process of an isolated FMU."""

from master.fmu.isolation.child import main

main()
