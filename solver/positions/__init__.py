"""Before measuring: which uncertainty a list of positions promises, and which positions are the best."""
