"""Many trials: each measured and reported, on the cores here or on a Dask cluster.

The work unit is one trial. What is done is known from the trial's own files, so a batch that was
cancelled or killed goes on where it stood, and it does not matter who measured which trial.
"""

from olivevib.batch.cluster import measure_on_cluster
from olivevib.batch.find import find_trials
from olivevib.batch.pool import cores, measure_here
from olivevib.batch.result import TrialResult

__all__ = ["TrialResult", "cores", "find_trials", "measure_here", "measure_on_cluster"]
