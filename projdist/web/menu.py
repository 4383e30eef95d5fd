"""The measures that pages show, in the groups and the order of their menu; scripts compute them from the frames."""

GROUPS = {
    "Areas and angles": ("fisher", "kavrayskiy", "airy", "jordan", "jordan_kavrayskiy"),
    "Areas": ("areal_scale", "log_areal_scale", "areal_error_ppm"),
    "Angles": ("angular_distortion", "log_anisotropy", "meridian_parallel_angle"),
    "Scales": ("tissot_semimajor", "tissot_semiminor", "meridional_scale", "parallel_scale", "scale_error_ppm"),
    "North": ("meridian_convergence",),
}

SHOWN_MEASURES = tuple(name for names in GROUPS.values() for name in names)
