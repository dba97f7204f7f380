"""When to recalibrate: the methods of ILAC-G24 with their reasons."""
