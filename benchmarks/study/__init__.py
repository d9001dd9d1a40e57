"""The study of hidden effects: worlds are drawn, what discovery says of them is judged, and the figures are told."""
