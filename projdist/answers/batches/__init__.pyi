from .jobs import Batch, BatchFailure, BatchResult, batch
from .tasks import Area, areas_of

__all__ = ["Area", "Batch", "BatchFailure", "BatchResult", "areas_of", "batch"]
