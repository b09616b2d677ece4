"""What is true of the results: scenes with known truth, figures, published results computed again."""
