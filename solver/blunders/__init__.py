"""What went wrong in a session: every blunder is a hypothesis, tested against the data and a prior, and ranked."""
