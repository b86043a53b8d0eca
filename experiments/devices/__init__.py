"""What devices cost and give: the precision of their products, and many of them at once."""
