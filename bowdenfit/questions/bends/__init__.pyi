from .curves import collect_preload as collect_preload
from .curves import collect_stretch as collect_stretch
from .loop_curves import collect_bending_loss as collect_bending_loss
from .loop_curves import collect_loops as collect_loops
from .loop_curves import collect_preload_window as collect_preload_window
from .motor_force_curves import collect_motor_forces as collect_motor_forces
from .ring_down_curves import collect_ring_downs as collect_ring_downs
