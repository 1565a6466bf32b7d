from .case_layouts import each as each
from .case_panels import bars as bars
from .case_panels import last as last
from .case_study import configuration_study as configuration_study
from .experiments import between as between
from .experiments import turned as turned
