"""Lower bounds on the error of the angular rate: of one sample (`sample`), over a run (`posterior`)."""

from gfimu.lazy_names import names_on_first_use

__getattr__ = names_on_first_use(
    "gfimu.bounds",
    {
        "alpha_std": "sample",
        "omega_products_jacobian": "sample",
        "posterior_rate_bound": "posterior",
        "rate_bound": "sample",
        "rate_bound_isotropic": "sample",
        "rate_information": "sample",
        "steady_rate_bound": "sample",
    },
)
