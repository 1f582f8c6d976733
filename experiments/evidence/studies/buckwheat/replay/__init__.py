"""The paper's runs simulated again, and their analysis beside the published one."""
