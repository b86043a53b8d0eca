"""What several papers' experiments share."""
