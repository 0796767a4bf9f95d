"""The references of the Methods paragraph, as in docs/references.md."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

REFERENCES: Mapping[str, str] = MappingProxyType(
    {
        "Bell2002": (
            "R. M. Bell, D. F. McCaffrey. Bias reduction in standard errors for linear regression with multi-stage "
            "samples. Survey Methodology 28 (2002) 169–181."
        ),
        "Benjamini1995": (
            "Y. Benjamini, Y. Hochberg. Controlling the false discovery rate: a practical and powerful "
            "approach to multiple testing. Journal of the Royal Statistical Society B 57 (1995) 289–300."
        ),
        "Bradley1952": (
            "R. A. Bradley, M. E. Terry. Rank analysis of incomplete block designs: I. The method of paired "
            "comparisons. Biometrika 39 (1952) 324–345."
        ),
        "Cameron2015": (
            "A. C. Cameron, D. L. Miller. A practitioner’s guide to cluster-robust inference. Journal of "
            "Human Resources 50 (2015) 317–372."
        ),
        "Dempster1958": (
            "A. P. Dempster. A high dimensional two sample significance test. Annals of Mathematical Statistics 29 "
            "(1958) 995–1010."
        ),
        "Efron1987": (
            "B. Efron. Better bootstrap confidence intervals. Journal of the American Statistical "
            "Association 82 (1987) 171–185."
        ),
        "Firth1993": "D. Firth. Bias reduction of maximum likelihood estimates. Biometrika 80 (1993) 27–38.",
        "Gelman2006": (
            "A. Gelman. Prior distributions for variance parameters in hierarchical models. Bayesian Analysis 1 (2006) "
            "515–534."
        ),
        "Heinze2002": (
            "G. Heinze, M. Schemper. A solution to the problem of separation in logistic regression. Statistics in "
            "Medicine 21 (2002) 2409–2419."
        ),
        "Hesterberg2015": (
            "T. C. Hesterberg. What teachers should know about the bootstrap: resampling in the "
            "undergraduate statistics curriculum. The American Statistician 69 (2015) 371–386."
        ),
        "Holm1979": (
            "S. Holm. A simple sequentially rejective multiple test procedure. Scandinavian Journal of "
            "Statistics 6 (1979) 65–70."
        ),
        "Huber1967": (
            "P. J. Huber. The behavior of maximum likelihood estimates under nonstandard conditions. Proc. "
            "Fifth Berkeley Symposium on Mathematical Statistics and Probability 1 (1967) 221–233."
        ),
        "Kaernbach1991": (
            "C. Kaernbach. Simple adaptive testing with the weighted up-down method. Perception & Psychophysics 49 "
            "(1991) 227–229."
        ),
        "Kendall1940": (
            "M. G. Kendall, B. Babington Smith. On the method of paired comparisons. Biometrika 31 (1940) 324–345."
        ),
        "Kish1965": "L. Kish. Survey sampling. Wiley, 1965.",
        "Kline2012": (
            "P. Kline, A. Santos. A score based approach to wild bootstrap inference. Journal of Econometric "
            "Methods 1 (2012) 23–41."
        ),
        "Ledoit2004": (
            "O. Ledoit, M. Wolf. A well-conditioned estimator for large-dimensional covariance matrices. Journal of "
            "Multivariate Analysis 88 (2004) 365–411."
        ),
        "Minka2001": (
            "T. P. Minka. Expectation propagation for approximate Bayesian inference. Proc. Uncertainty in Artificial "
            "Intelligence 17 (2001) 362–369."
        ),
        "Medina2016": (
            "V. Medina. Visuo-perceptual validation methods for physically based image synthesis. Doctoral "
            "thesis, MINES ParisTech, PSL, 2016."
        ),
        "Piepho2004": (
            "H.-P. Piepho. An algorithm for a letter-based representation of all-pairwise comparisons. "
            "Journal of Computational and Graphical Statistics 13 (2004) 456–466."
        ),
        "Schutt2016": (
            "H. H. Schütt, S. Harmeling, J. H. Macke, F. A. Wichmann. Painfree and accurate Bayesian estimation of "
            "psychometric functions for (potentially) overdispersed data. Vision Research 122 (2016) 105–123."
        ),
        "Sharma2005": (
            "G. Sharma, W. Wu, E. N. Dalal. The CIEDE2000 color-difference formula: implementation notes, "
            "supplementary test data, and mathematical observations. Color Research and Application 30 "
            "(2005) 21–30."
        ),
        "Watson2017": (
            "A. B. Watson. QUEST+: A general multidimensional Bayesian adaptive psychometric method. Journal of Vision "
            "17(3) (2017) 10."
        ),
        "Webb2023": (
            "M. D. Webb. Reworking wild bootstrap-based inference for clustered errors. Canadian Journal of "
            "Economics 56 (2023) 839–858."
        ),
        "White1982": "H. White. Maximum likelihood estimation of misspecified models. Econometrica 50 (1982) 1–25.",
        "Wilson1927": (
            "E. B. Wilson. Probable inference, the law of succession, and statistical inference. Journal of "
            "the American Statistical Association 22 (1927) 209–212."
        ),
        "Davidson1970": (
            "R. R. Davidson. On extending the Bradley-Terry model to accommodate ties in paired comparison "
            "experiments. Journal of the American Statistical Association 65 (1970) 317–328."
        ),
        "DavidsonBeaver1977": (
            "R. R. Davidson, R. J. Beaver. On extending the Bradley-Terry model to incorporate within-pair "
            "order effects. Biometrics 33 (1977) 693–702."
        ),
        "ITU500": (
            "Recommendation ITU-R BT.500. Methodologies for the subjective assessment of the quality of "
            "television images. International Telecommunication Union."
        ),
        "Gescheider1997": "G. A. Gescheider. Psychophysics: the fundamentals, 3rd edition. Lawrence Erlbaum, 1997.",
        "Friedman1937": (
            "M. Friedman. The use of ranks to avoid the assumption of normality implicit in the analysis of "
            "variance. Journal of the American Statistical Association 32 (1937) 675–701."
        ),
        "Springall1973": (
            "A. Springall. Response surface fitting using a generalization of the Bradley-Terry paired "
            "comparison model. Applied Statistics 22 (1973) 59–68."
        ),
        "Nemenyi1963": (
            "P. B. Nemenyi. Distribution-free multiple comparisons. Doctoral thesis, Princeton University, 1963."
        ),
        "Stuart1955": (
            "A. Stuart. A test for homogeneity of the marginal distributions in a two-way classification. "
            "Biometrika 42 (1955) 412–416."
        ),
    }
)


@dataclass(slots=True)
class Citations:
    """Numbers references in the order of their first citation."""

    keys: list[str] = field(default_factory=list)

    def cite(self, *keys: str) -> str:
        """Return the numbers of references in square brackets, such as "[1, 2]"."""
        for key in keys:
            if key not in self.keys:
                self.keys.append(key)
        return f"[{', '.join(str(self.keys.index(key) + 1) for key in keys)}]"

    def works(self) -> tuple[str, ...]:
        """Return the references cited so far, in order."""
        return tuple(REFERENCES[key] for key in self.keys)
