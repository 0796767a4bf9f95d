from .classes import classify as classify
from .conclusions import Conclusion as Conclusion
