"""The laws that any model is judged by, one class a file, and the search for the state that breaks them."""
