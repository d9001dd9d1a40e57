"""The models of the paper, by a short recipe: what `benchmarks/paper.py` trains."""

from .contenders import VARIED, Contender
from .scored import Study

SHORT = (("epochs", 40), ("patience", 40), ("shrink", False))
"""The budget of a network: with it five seeds of five cases take under half an hour on two processors."""
CONTENDERS = {
    "Fossen as it is": Contender("nominal"),
    "Fossen calibrated": Contender("calibrated"),
    "pure MLP": Contender("nominal", "mlp", pure=True, settings=SHORT, audited=False),
    "pure LSTM": Contender("nominal", "lstm", pure=True, settings=SHORT, audited=False),
    "pure TCN": Contender("nominal", "tcn", pure=True, settings=SHORT, audited=False),
    "residual MLP": Contender("nominal", "mlp", settings=SHORT, audited=False),
    "hybrid MLP": Contender("calibrated", "mlp", settings=SHORT, audited=False),
    "hybrid LSTM": Contender("calibrated", "lstm", settings=SHORT, audited=False),
    "hybrid TCN": Contender("calibrated", "tcn", settings=SHORT, audited=False),
    "hybrid MLP without laws": Contender("calibrated", "mlp", settings=(*SHORT, ("lambda_phys", 0.0)), audited=False),
    "hybrid MLP that sees heading": Contender("calibrated", "mlp", heading=True, settings=SHORT, audited=False),
    "hybrid MLP, varied": Contender("calibrated", "mlp", settings=(*SHORT, ("augmentation", VARIED)), audited=False),
}
STUDY = Study(CONTENDERS, ())
