"""The platform at rest: tensions that hold it, where it hangs, how stiff it is, what moves it.

**Stiffness** matrices map a small twist (rotation, translation) about Po in W to the wrench that
resists it. A pose of rest is a minimum of the potential energy of cables and weight; its verdict
is judged by the Hessian.

**Forward kinematics**: the pose that fits cable lengths, near a guess. An answer is a pose that
reproduces the lengths, or an error; never the nearest pose alone.

**All poses of rest**, stable or not, with any cables slack. Inextensible cables: the poses at which
a set of cables is taut are the real solutions of a system of polynomials, of which all complex ones
are followed along paths from constants that have been solved once; each is then proven by interval
arithmetic, and judged by the Hessian of the potential energy along the motions that taut cables
leave. Points are in closed form. Elastic cables: searches from random poses, until an estimate says
that few more would be found.

Source: servoing thesis 1.2.4, 2.2 and 2.3; Pott, 2018; Carricato and Merlet, Stability analysis of
underconstrained cable-driven parallel robots, 2013; Abbasnejad and Carricato, 2015; Sommese and
Wampler, 2005; Boender and Rinnooy Kan, Bayesian stopping rules for multistart global optimization
methods, 1987.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
