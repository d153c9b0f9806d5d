"""What is proportional and should be equal: scale, mistakes (of units), lag."""
