"""Lower bounds on the error of the angular rate: of one sample (`sample`), over a run (`posterior`)."""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.rate.bounds.posterior import posterior_rate_bound as posterior_rate_bound
    from gfimu.rate.bounds.sample import alpha_std as alpha_std
    from gfimu.rate.bounds.sample import omega_products_jacobian as omega_products_jacobian
    from gfimu.rate.bounds.sample import rate_bound as rate_bound
    from gfimu.rate.bounds.sample import rate_bound_isotropic as rate_bound_isotropic
    from gfimu.rate.bounds.sample import rate_information as rate_information
    from gfimu.rate.bounds.sample import steady_rate_bound as steady_rate_bound
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
