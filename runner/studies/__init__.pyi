from .contents import typed as typed
from .options import Kind as Kind
from .options import StudyOptions as StudyOptions
from .study import CopiedStudy as CopiedStudy
from .study import NewStudy as NewStudy
from .study import copy_shipped as copy_shipped
from .study import new_study as new_study
from .study import shipped_studies as shipped_studies
