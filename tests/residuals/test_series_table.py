"""Rows of a series in memory."""

from io import BytesIO

import numpy as np
import pandas as pd

from undertow.residuals.series import SeriesTable

TABLE = SeriesTable(
    {
        "time": np.array([0.0, 0.1, 1e-7, 1e20]),
        "log": np.array([0, 0, 1, 1]),
        "part": np.array(["train", "train", "a,b", "test"], object),
        "u": np.array([0.5, np.nan, -0.0, 123456.7891011]),
    }
)


def test_the_text_is_that_of_a_frame():
    stream = BytesIO()
    TABLE.write(stream)
    assert stream.getvalue().decode() == TABLE.frame().to_csv(index=False, lineterminator="\n")


def test_a_frame_of_whole_numbers_has_them_as_numbers_that_can_be_missing():
    table = SeriesTable.of(pd.DataFrame({"u": [1, 2], "log": [0, 1], "part": ["train", "test"]}))
    assert table["u"].dtype == float
    assert table["log"].dtype.kind == "i"
    assert list(table["part"]) == ["train", "test"]


def test_rows_and_columns_are_taken_by_name():
    assert len(TABLE) == 4
    assert "u" in TABLE
    assert "v" not in TABLE
    assert TABLE[["time", "u"]].shape == (4, 2)
    assert TABLE[[]].shape == (4, 0)
    assert len(TABLE.rows(TABLE["log"] == 1)) == 2
    assert len(SeriesTable({})) == 0
