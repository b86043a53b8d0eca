"""What all modules share: argument checks, XLA habits, linear algebra, host facts. Private."""
