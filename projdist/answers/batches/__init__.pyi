from .areas import Area, areas_of
from .jobs import Batch, BatchFailure, BatchResult, batch

__all__ = ["Area", "Batch", "BatchFailure", "BatchResult", "areas_of", "batch"]
