"""Reports: words and pictures for an engineer, made of facts from the floors below."""
