from .fields import array as array
from .fields import number as number
from .fields import section as section
from .fields import sections as sections
from .fields import switch as switch
from .fields import text as text
from .fields import whole as whole
from .typed_yaml import closest as closest
