"""Lower bounds on the error of the angular rate: of one sample (`sample`), over a run (`posterior`)."""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.rate.bounds.posterior import posterior_rate_bound
    from gfimu.rate.bounds.sample import (
        alpha_std,
        omega_products_jacobian,
        rate_bound,
        rate_bound_isotropic,
        rate_information,
        steady_rate_bound,
    )
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
