from .compare import WrittenAgreement as WrittenAgreement
from .compare import compare_with_observers as compare_with_observers
from .options import AgreementOptions as AgreementOptions
