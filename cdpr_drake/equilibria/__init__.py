"""All poses of rest of a platform on cables, stable or not, with any cables slack.

Inextensible cables: the poses at which a set of cables is taut are the real solutions of a system
of polynomials, of which all complex ones are followed along paths from constants that have been
solved once; each is then proven by interval arithmetic, and judged by the Hessian of the potential
energy along the motions that taut cables leave. Points are in closed form. Elastic cables: searches
from random poses, until an estimate says that few more would be found.

Source: Carricato and Merlet, Stability analysis of underconstrained cable-driven parallel robots,
2013; Abbasnejad and Carricato, 2015; Sommese and Wampler, 2005; Boender and Rinnooy Kan, Bayesian
stopping rules for multistart global optimization methods, 1987.
"""

from cdpr_drake.equilibria.enumeration import AllRests, all_rests
from cdpr_drake.equilibria.given_position import PlacedRests, placed_rests
from cdpr_drake.equilibria.multi_start import SampledRests, sampled_rests
from cdpr_drake.equilibria.problem import JUST_TAUT, Certificate, HangingPlatform, Rest
from cdpr_drake.equilibria.real_solutions import PathCount
from cdpr_drake.equilibria.start_systems import KINDS, find_start_system, write_start_systems

__all__ = [
    "JUST_TAUT", "KINDS", "AllRests", "Certificate", "HangingPlatform", "PathCount", "PlacedRests",
    "Rest", "SampledRests", "all_rests", "find_start_system", "placed_rests", "sampled_rests",
    "write_start_systems",
]  # fmt: skip
