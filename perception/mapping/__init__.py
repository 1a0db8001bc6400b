"""Localisation and mapping: scans matched with each other, their poses in a graph, loops closed."""

from perception.mapping.cloud import Cloud, cloud_of
from perception.mapping.mapper import Mapper
from perception.mapping.settings import MappingSettings

__all__ = ["Cloud", "Mapper", "MappingSettings", "cloud_of"]
