"""What may be chosen of an analysis, and its defaults: here, so that commands name them before numpy is there."""

from __future__ import annotations

from typing import Literal, TypeAlias

Model: TypeAlias = Literal["bradley-terry", "davidson", "rao-kupper", "thurstone"]
DistancePrior: TypeAlias = Literal["gaussian", "bounded", "none"]
Adjust: TypeAlias = Literal["none", "holm", "bh", "maxz"]
CovarianceChoice: TypeAlias = Literal["auto", "model", "scaled", "sandwich", "shrinkage"]
Interval: TypeAlias = Literal["wald", "bootstrap"]
TARGET, REPLICATES, SEED = 0.8, 1000, 2016
"""Power that a pair should reach; studies simulated for each number of observers, and their random seed."""
