from .contents import typed as typed
from .options import Kind as Kind
from .options import StudyOptions as StudyOptions
from .shipped import CopiedStudy as CopiedStudy
from .shipped import copy_shipped as copy_shipped
from .shipped import shipped_studies as shipped_studies
from .study import NewStudy as NewStudy
from .study import new_study as new_study
