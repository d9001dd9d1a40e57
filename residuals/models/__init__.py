"""Whatever answers as a model: a vehicle, a baseline, a network, an ONNX file, a Python function."""
