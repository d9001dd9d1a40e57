"""Rivals: other ways to model a boat from its log, each answering as a `Model` does, so that all are judged alike."""
