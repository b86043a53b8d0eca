"""Ground floor of all modules: argument checks, XLA habits, linear algebra, host facts. Private."""
