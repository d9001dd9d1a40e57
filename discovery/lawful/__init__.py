"""The chosen parameters again under the laws of a hull: convex programmes, proofs, and the price of a law."""
