"""What an engineer reads at the end: words and pictures made of facts that were found on the floors below."""
