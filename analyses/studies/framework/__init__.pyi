from .case_definition import CaseStudy as CaseStudy
from .case_layouts import each as each
from .case_panels import bars as bars
from .case_panels import last as last
from .experiments import between as between
from .experiments import turned as turned
from .seeded_study import DrawnStudy as DrawnStudy
from .seeded_study import SeededStudy as SeededStudy
