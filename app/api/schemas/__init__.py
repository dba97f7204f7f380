"""What goes over the wire: fields in laboratory units, each with its unit in the name."""
