from .deferred_figures import write_pictures as write_pictures
from .exported_logs import LOG_WRITERS as LOG_WRITERS
from .log_files import finite as finite
from .log_files import write_json as write_json
from .log_files import write_whole as write_whole
from .written_files import whole_file as whole_file
