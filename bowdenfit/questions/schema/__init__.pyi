from .schemas import make_schema as make_schema
