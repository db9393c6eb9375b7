"""VDA 5050: AGVs of any maker as robots of the hive, over MQTT."""
