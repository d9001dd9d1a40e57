"""One reader a file for every log format; `registry` lists them all."""
