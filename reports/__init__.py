"""What an engineer reads at the end: where the model fails, which effect is missing, and the page that shows it."""
