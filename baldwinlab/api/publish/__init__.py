"""Write the results, figures and reports of studies."""
