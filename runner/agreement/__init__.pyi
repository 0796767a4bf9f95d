from .compare import AgreementOptions as AgreementOptions
from .compare import WrittenAgreement as WrittenAgreement
from .compare import compare_with_observers as compare_with_observers
