from .serve import serve_app as serve_app
