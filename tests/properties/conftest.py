"""How long properties are tried: little and always the same here, long and anew by make fuzz."""

from hypothesis import HealthCheck, settings

COMMON = {
    "deadline": None,
    "database": None,
    "suppress_health_check": [HealthCheck.too_slow, HealthCheck.data_too_large],
}
settings.register_profile("suite", max_examples=20, derandomize=True, **COMMON)
settings.register_profile("fuzz", max_examples=1000, print_blob=True, **COMMON)
settings.load_profile("suite")
