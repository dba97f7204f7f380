"""The station's side of the service: records forwarded, the live report, commands taken."""
